"""What a claim is, the verdict on it, and what each engine says of it."""
