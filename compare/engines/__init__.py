"""Other engines on the same ball: an adapter each, imported only when a run asks for it. None knows the theory."""
