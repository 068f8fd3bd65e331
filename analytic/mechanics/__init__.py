"""Forces and equations of motion: drag, the nine cases, and the contact problem of one instant."""
