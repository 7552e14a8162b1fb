"""What is tried to solve a task: initial guesses in parallel, and fallback settings one after the other."""
