"""How it is measured: protocols, settling, brackets, step pairs; numbers with uncertainties."""
