"""Tables for the exchange with other programs: inputs, outputs, controllers, names, geometry."""
