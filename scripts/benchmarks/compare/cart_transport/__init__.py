"""Cart transport, a task of IMPACT's benchmark: a driven cart brings the cargo that slides on it to another place."""
