"""What commands share: arguments, bars, tables, the machine."""
