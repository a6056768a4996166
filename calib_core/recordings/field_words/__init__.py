"""The vocabulary of radars: which words in the name of a message's field or a table's column state which quantity and unit."""
