"""Reading and writing that damaged or hostile files cannot mislead."""
