"""The addresses of the HTTP interface, one resource a file."""
