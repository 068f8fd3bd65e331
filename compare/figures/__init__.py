"""How figures and pages look: style, pictures, templates, captions."""
