"""The classical discrete-time matrices of rigid and flexible bodies and hinges."""
