//! Configuration text to valid values, with error positions
