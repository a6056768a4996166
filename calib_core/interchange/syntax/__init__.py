"""The syntaxes that the formats use: strict JSON, YAML, XML, zip and mat files. No semantics, no geometry."""
