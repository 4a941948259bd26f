"""What a person will do (Eq. 2): actions, costs, best actions everywhere."""
