"""Pictures and maps, for people and for programs that draw."""
