"""The learned homographies of the paper's table: DHN, IHN and OTLE, trained on drawn masks alone."""
