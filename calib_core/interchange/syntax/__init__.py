"""The syntaxes that the formats use: strict JSON, YAML, XML, zip, mat and MCAP files. No semantics, no geometry."""
