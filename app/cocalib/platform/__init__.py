"""What the program needs of the system it runs on: files, terminal, signals, memory, hosts, and where its own files are."""
