// The place of an invocation in its dispatch. Stands before every kernel.

struct Invocation {
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
}

// Invocations of a workgroup without shared memory.
const GROUP = 64u;

// The invocation's number. Workgroups fill x first, then y, because one dimension holds at most 65
// 535 of them. The last row in y may be longer than needed, so the number may be too large for the
// arrays.
//
// An entry point passes the members and not the `Invocation`. Under Direct3D naga knows `groups`
// only where the entry point itself names it, and in another function reads the group's own number
// instead.
fn place(group: vec3<u32>, groups: vec3<u32>, lane: u32, size: u32) -> u32 {
    return (group.y * groups.x + group.x) * size + lane;
}
