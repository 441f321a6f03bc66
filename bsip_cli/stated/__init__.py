"""What is stated of a person, in the words and units that people use."""
