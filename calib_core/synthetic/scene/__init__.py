"""The simulated scene: what stands in it, who walks through it, and where the reflector is put."""
