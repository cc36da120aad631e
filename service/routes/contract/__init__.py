"""Parts that routes share: required scopes, documented problems, entity tags, pages of lists, exported poses."""
