"""Tables of radar returns as text or JSON: names, units and values say what their columns hold."""
