"""Forces and equations of motion: drag, Coulomb friction, the nine cases, and the contact problem
of one instant."""
