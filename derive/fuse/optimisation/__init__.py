"""What makes a straight line of code fast: order, balance, registers, angles together."""
