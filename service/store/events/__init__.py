"""Events of venues and jobs: the log, its followers, and the outbox of webhooks and callbacks. All SQL about them."""
