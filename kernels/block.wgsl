// Blocks of 256 numbers in f64, of which a workgroup finds one.

const BLOCK = 256u;
// Numbers that one invocation takes. Barriers cost more than arithmetic.
const SHARE = 16u;
// Stands for numbers that are not finite.
const LARGEST = 1.7e308lf;

// A number that is not negative, or LARGEST if it is not finite. The comparison is false for a NaN
// too. WGSL's max would drop it.
fn bounded(number: f64) -> f64 {
    if (number <= LARGEST) {
        return number;
    }
    return LARGEST;
}
