"""What routes promise alike: whom they need, which problems they answer, entity tags, and files of poses."""
