"""What the paper states, what `analytic` predicts, and the judge."""
