"""The engines on trial: the study's own in `study`, and adapters of others."""

import model

# Not in the package above: pytest loads that one in every run, also where somebody else's `model`
# is in the way.
if not hasattr(model, "Parameters"):
    raise ImportError(
        f"{model.__file__} hides the package model of dualball: rename that, or work in another "
        f"folder"
    )
