"""The measures of a pitch, from the lines that its cameras see."""
