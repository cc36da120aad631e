"""People who cross the seams of stitched views: rendered clips with truth, and scores of several seams."""
