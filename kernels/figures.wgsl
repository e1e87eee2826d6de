// The largest number and the sum of each list of numbers. One workgroup per list.

struct Params {
    n_lists: u32,
    // Numbers of a list.
    length: u32,
    // Place of the first list's result in `figures`.
    first: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Numbers that are not negative, at most LARGEST [n_lists * length].
@group(0) @binding(1) var<storage, read> partials: array<f64>;
// Largest number and sum of each list; LARGEST where a sum is not finite.
@group(0) @binding(2) var<storage, read_write> figures_of: array<vec2<f64>>;

@compute @workgroup_size(BLOCK)
fn figures(here: Invocation) {
    let list = place(here.group, here.groups, here.lane, BLOCK) / BLOCK;
    var largest = 0.0lf;
    var sum = 0.0lf;
    if (list < params.n_lists) {
        for (var i = here.lane; i < params.length; i += BLOCK) {
            let number = partials[list * params.length + i];
            largest = max(largest, number);
            sum += number;
        }
    }
    let largest_of_list = largest_of_block(here.lane, largest);
    // Both use the same array of the workgroup.
    workgroupBarrier();
    let sum_of_list = sum_of_block(here.lane, sum);
    if (here.lane == 0u && list < params.n_lists) {
        figures_of[params.first + list] = vec2<f64>(largest_of_list, bounded(sum_of_list));
    }
}
