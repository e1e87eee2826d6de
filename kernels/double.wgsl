// The number type of a kernel in double precision, for adapters that have it.
alias real = f64;

