"""What both kinds of rendering paint with: colours, noise fixed to places in the world, letters."""
