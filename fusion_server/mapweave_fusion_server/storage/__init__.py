"""The SQLite file behind the store: schema, transactions, what is saved of a damaged one."""
