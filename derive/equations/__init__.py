"""Newton-Euler, hinges, laws and the sweep as matrix equations of symbols."""
