"""What makes a release and the site of the documents."""
