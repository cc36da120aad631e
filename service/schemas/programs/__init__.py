"""What programs beside the API are asked, and what they answer."""
