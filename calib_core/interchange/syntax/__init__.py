"""The syntaxes under the formats: strict JSON, YAML, XML, zip and mat files. No meaning, no geometry."""
