"""Courts of any sport on any ground, seen by any camera: less detail, more variety."""
