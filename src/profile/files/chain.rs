//! Joins line segments to curves.

/// The curves formed by segments between points, in the order of their first points. A closed curve
/// repeats its first point.
///
/// # Errors
/// The index of a point at which more than two segments meet.
pub(super) fn chains(n_points: usize, segments: &[[usize; 2]]) -> Result<Vec<Vec<usize>>, usize> {
    const NONE: usize = usize::MAX;
    let mut neighbours = vec![[NONE; 2]; n_points];
    for &[a, b] in segments {
        // A segment without length, or a repeated one, joins nothing.
        if a == b || neighbours[a].contains(&b) {
            continue;
        }
        for (me, other) in [(a, b), (b, a)] {
            match neighbours[me].iter().position(|&neighbour| neighbour == NONE) {
                Some(place) => neighbours[me][place] = other,
                None => return Err(me),
            }
        }
    }
    let is_end = |point: &usize| neighbours[*point].contains(&NONE);
    let is_used = |point: &usize| neighbours[*point] != [NONE; 2];
    let mut visited = vec![false; n_points];
    let mut curves: Vec<Vec<usize>> = Vec::new();
    // Open curves come first, from an end. The rest are loops.
    for start in (0..n_points).filter(is_end).chain(0..n_points).filter(is_used) {
        if visited[start] {
            continue;
        }
        let mut curve = Vec::new();
        let mut next = Some(start);
        while let Some(point) = next {
            visited[point] = true;
            curve.push(point);
            next = neighbours[point].into_iter().find(|&neighbour| neighbour != NONE && !visited[neighbour]);
        }
        if !is_end(&start) {
            curve.push(start);
        }
        curves.push(curve);
    }
    curves.sort_by_key(|curve| curve.iter().min().copied());
    Ok(curves)
}

#[cfg(test)]
mod tests {
    use super::chains;

    #[test]
    fn open_and_closed_curves_are_joined() {
        let segments = [[5, 4], [1, 0], [2, 1], [4, 6], [6, 5], [3, 2], [1, 2], [7, 7]];
        assert_eq!(chains(9, &segments), Ok(vec![vec![0, 1, 2, 3], vec![4, 5, 6, 4]]));
        assert_eq!(chains(4, &[[0, 1], [0, 2], [0, 3]]), Err(0));
        assert_eq!(chains(3, &[]), Ok(vec![]));
    }
}
