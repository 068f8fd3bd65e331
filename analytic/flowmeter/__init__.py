"""The ball as a flowmeter: characteristic curve and range, response to unsteady flow, design."""
