"""Any instrument on any machine: a reading is a statement about tool side and work side."""
