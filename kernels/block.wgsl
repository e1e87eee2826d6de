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

var<workgroup> of_lanes: array<f64, BLOCK>;

// The largest of a block's numbers, one from each invocation. The first invocation has it.
fn largest_of_block(lane: u32, number: f64) -> f64 {
    var largest = number;
    of_lanes[lane] = number;
    workgroupBarrier();
    if (lane < BLOCK / SHARE) {
        for (var other = 1u; other < SHARE; other++) {
            largest = max(largest, of_lanes[lane + other * (BLOCK / SHARE)]);
        }
        of_lanes[lane] = largest;
    }
    workgroupBarrier();
    if (lane == 0u) {
        for (var other = 1u; other < BLOCK / SHARE; other++) {
            largest = max(largest, of_lanes[other]);
        }
    }
    return largest;
}

// The sum of a block's numbers, one from each invocation. The first invocation has it.
fn sum_of_block(lane: u32, number: f64) -> f64 {
    var sum = number;
    of_lanes[lane] = number;
    workgroupBarrier();
    if (lane < BLOCK / SHARE) {
        for (var other = 1u; other < SHARE; other++) {
            sum += of_lanes[lane + other * (BLOCK / SHARE)];
        }
        of_lanes[lane] = sum;
    }
    workgroupBarrier();
    if (lane == 0u) {
        for (var other = 1u; other < BLOCK / SHARE; other++) {
            sum += of_lanes[other];
        }
    }
    return sum;
}
