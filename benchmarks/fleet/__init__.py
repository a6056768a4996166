"""How well the fleet's mathematics keeps what it states, on simulated fleets."""
