"""Who may do what, proved by certificates; and settings of Zenoh that a user adds."""
