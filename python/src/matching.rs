//! Finds for each point the vertex at its place.

use std::collections::HashMap;

use idmesh::DVec3;

/// For each point `[n_points]` the index of the nearest vertex within `tolerance`, and -1 where no
/// vertex is as near. Points and vertices are finite, in one unit.
pub fn nearest(points: &[DVec3], vertices: &[DVec3], tolerance: f64) -> Vec<i64> {
    // A box is twice as wide as the tolerance, so a vertex near a point is in a box beside it.
    let width = 2.0 * tolerance;
    let place = |point: DVec3| (point / width).floor().to_array();
    let key = |place: [f64; 3]| place.map(f64::to_bits);
    let mut boxes: HashMap<[u64; 3], Vec<u32>> = HashMap::with_capacity(vertices.len());
    for (index, &vertex) in (0..).zip(vertices) {
        // Plus zero and minus zero are one box.
        boxes.entry(key(place(vertex).map(|x| x + 0.0))).or_default().push(index);
    }
    let find = |&point: &DVec3| {
        let [x, y, z] = place(point);
        let mut best: Option<(f64, u32)> = None;
        for step in 0..27 {
            let by = |power: i32| f64::from(step / 3_i32.pow(power as u32) % 3 - 1);
            let beside = [x + by(0), y + by(1), z + by(2)].map(|x| x + 0.0);
            for &index in boxes.get(&key(beside)).into_iter().flatten() {
                let distance = vertices[index as usize].distance(point);
                if distance <= tolerance && best.is_none_or(|best| (distance, index) < best) {
                    best = Some((distance, index));
                }
            }
        }
        best.map_or(-1, |(_, index)| i64::from(index))
    };
    points.iter().map(find).collect()
}
