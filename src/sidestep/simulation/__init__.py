"""Worlds with people in them: observe, believe, predict, plan, move."""
