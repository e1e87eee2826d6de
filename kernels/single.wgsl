// The number type of a kernel in single precision.
alias real = f32;

