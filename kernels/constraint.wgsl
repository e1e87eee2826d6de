// The constraint of a vertex. Stands before every kernel that moves the vertices of a spring
// network, behind the file of its number type.

// Constraint of each vertex [n_vertices]: xyz = unit normal or direction, w = one of the kinds
// below.
@group(0) @binding(3) var<storage, read> constraint: array<vec4<real>>;

const FREE = 0.0;
const HELD = 1.0;
const IN_PLANE = 2.0;
const ON_LINE = 3.0;

// Projects a vector on the directions that the constraint of its vertex allows.
fn project(row: u32, v: vec3<real>) -> vec3<real> {
    let c = constraint[row];
    let along = c.x * v.x + c.y * v.y + c.z * v.z;
    if (c.w == FREE) {
        return v;
    }
    if (c.w == IN_PLANE) {
        return v - along * c.xyz;
    }
    if (c.w == ON_LINE) {
        return along * c.xyz;
    }
    return vec3<real>(0.0);
}
