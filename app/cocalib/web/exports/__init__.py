"""What the export panel says: its list of formats and fields; of one file its numbers, their direction and the check point."""
