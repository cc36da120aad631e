"""The network itself, and its way into the file that is served and back."""
