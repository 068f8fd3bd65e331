"""The model in closed form: what the equations of the paper say the ball does."""

from analytic.dynamics import contact_forces, vector_field

__all__ = ["contact_forces", "vector_field"]
