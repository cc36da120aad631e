"""What is told of a venue, unasked: events, who hears of them, and which addresses may."""
