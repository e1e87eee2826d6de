//! The derivative of stage wing by the points of the new profiles.
//!
//! A product begins or ends with the interpolation of the profiles
//! ([`Wings::interpolate_forward`], [`Wings::interpolate_reverse`]), as the stage begins with it.
//! The slide of a junction's vertex follows the vertex and the span direction there. Networks are
//! linear.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::{Mirror, Wing, Wings};
use crate::families::{Families, PlacedBy};
use crate::mesh::Displacement;
use crate::profile::{LoftChange, Profile, WhyNot};
use crate::relaxation::{Convergence, Stopping};
use crate::stage::{Kept, NoProduct, Products, SetUp};

/// What the product of a wing hands from its interpolation to its junction, or back.
pub(super) struct WingProduct {
    loft: LoftChange,
    /// Change of the displacement by the wing's own profiles, or the derivative by it
    /// `[n_vertices of the wing]`.
    own: Vec<DVec3>,
    /// Change of the span direction at each vertex of the junction, or the derivative by it.
    direction: Vec<DVec3>,
}

impl Mirror {
    /// The transpose of [`Mirror::unfold`], which is itself.
    fn unfold_reverse(&self, vertex: usize, gradient: DVec3) -> DVec3 {
        self.unfold(vertex, gradient)
    }
}

impl Wing {
    fn loft(&self, kept: &Kept) -> Result<LoftChange, NoProduct> {
        let new = kept.profiles.get(&self.name).map_or(&[][..], Vec::as_slice);
        let of_wing = |(profile, why): WhyNot| NoProduct::Match { wing: self.name.clone(), profile, why };
        LoftChange::new(&self.interpolation, new).map_err(of_wing)
    }

    /// A direction at a vertex, mirrored to the vertex's side of the mirror plane.
    fn reflected(&self, place: usize, along: DVec3) -> DVec3 {
        self.mirror.as_ref().map_or(along, |mirror| mirror.reflect(place, along))
    }

    /// The derivatives of the slide's end by the place before the slide and by the span direction,
    /// for each vertex of the junction.
    ///
    /// - `before`: displacements before the slide
    ///
    /// # Errors
    /// A vertex does not slide smoothly.
    fn slides(&self, set_up: &SetUp, loft: &LoftChange, before: &[DVec3]) -> Result<Vec<(DMat3, DMat3)>, NoProduct> {
        let of_vertex = |(&place, &before): (&usize, &DVec3)| {
            let vertex = self.vertices[place];
            let at = set_up.mesh.vertices[vertex as usize] + before;
            let along = self.reflected(place, loft.direction(&self.interpolation, place)).try_normalize();
            let why =
                "slides along the span to a place where the line only touches the surface it shares with the wing";
            set_up.families.settle_along_change(vertex, at, along).ok_or(NoProduct::Vertex { vertex, why })
        };
        self.junction.iter().zip(before).map(of_vertex).collect()
    }
}

impl Wings {
    /// The wing, and why it has no derivative by one of its profiles in the last design, if a wing
    /// has none.
    pub fn why_not(&self) -> Option<(&str, WhyNot)> {
        self.wings.iter().zip(&self.moved).find_map(|(wing, moved)| Some((wing.name.as_str(), moved.why_not?)))
    }

    /// A profile of the last design at which the derivative is that of one side alone: its wing,
    /// its number, and why.
    pub fn kink(&self) -> Option<(&str, WhyNot)> {
        self.wings.iter().zip(&self.moved).find_map(|(wing, moved)| Some((wing.name.as_str(), moved.kink?)))
    }

    /// Change of what [`Wings::interpolate`] makes. [`Products::forward`] goes on with the
    /// junctions.
    ///
    /// - `direction`: changes of the points of new profiles, by wing and number
    /// - `change` `[n_vertices]`: set at the wings' vertices
    ///
    /// # Errors
    /// A profile has no derivative.
    pub fn interpolate_forward(
        &mut self,
        families: &Families,
        kept: &Kept,
        direction: &BTreeMap<String, Vec<Profile>>,
        change: &mut Displacement,
    ) -> Result<(), NoProduct> {
        self.products.clear();
        for wing in &self.wings {
            let given = direction.get(&wing.name).map_or(&[][..], Vec::as_slice);
            let of_profile = |own: &Profile| {
                let given = given.iter().find(|given| given.number == own.number);
                given.map_or_else(|| vec![DVec3::ZERO; own.points.len()], |given| given.points.clone())
            };
            let of_points: Vec<Vec<DVec3>> =
                kept.profiles.get(&wing.name).into_iter().flatten().map(of_profile).collect();
            let loft = wing.loft(kept)?;
            let mut of_wing = loft.forward(&wing.interpolation, &of_points);
            if let Some(mirror) = &wing.mirror {
                let all = of_wing.displacement.iter_mut().enumerate();
                all.for_each(|(place, change)| *change = mirror.unfold(place, *change));
            }
            for (place, (&vertex, by)) in wing.vertices.iter().zip(&of_wing.displacement).enumerate() {
                if families.placed_by[vertex as usize] == PlacedBy::Wing && wing.shared.owner(place).is_none() {
                    change[vertex as usize] = *by;
                }
            }
            let turned = |&place: &usize| wing.reflected(place, loft.turned(&wing.interpolation, place, &of_wing));
            let direction = wing.junction.iter().map(turned).collect();
            let own = std::mem::take(&mut of_wing.displacement);
            self.products.push(WingProduct { loft, own, direction });
        }
        Ok(())
    }

    /// The transpose of [`Wings::interpolate_forward`], after [`Products::reverse`]: the derivative
    /// by the points of the new profiles of each wing, in the order of the design.
    ///
    /// - `gradient` `[n_vertices]`: zero at the wings' vertices on exit
    pub fn interpolate_reverse(
        &mut self,
        families: &Families,
        gradient: &mut Displacement,
    ) -> BTreeMap<String, Vec<Vec<DVec3>>> {
        let products = std::mem::take(&mut self.products);
        let of_wing = |(wing, WingProduct { loft, mut own, direction }): (&Wing, WingProduct)| {
            for (place, (&vertex, by)) in wing.vertices.iter().zip(&mut own).enumerate() {
                if families.placed_by[vertex as usize] == PlacedBy::Wing && wing.shared.owner(place).is_none() {
                    *by += std::mem::take(&mut gradient[vertex as usize]);
                }
                if let Some(mirror) = &wing.mirror {
                    *by = mirror.unfold_reverse(place, *by);
                }
            }
            let pairs = wing.junction.iter().zip(&direction);
            let by_direction: Vec<(usize, DVec3)> =
                pairs.map(|(&place, &by)| (place, wing.reflected(place, by))).collect();
            (wing.name.clone(), loft.reverse(&wing.interpolation, &own, &by_direction))
        };
        self.wings.iter().zip(products).map(of_wing).collect()
    }
}

impl Products for Wings {
    fn keep(&mut self, kept: &mut Kept) {
        kept.junctions.clone_from(&self.before_slide);
    }

    /// [`Wings::interpolate_forward`] must run before.
    fn forward(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let mut convergence = Convergence::nothing_to_do();
        let products = std::mem::take(&mut self.products);
        for ((wing, product), before) in self.wings.iter_mut().zip(products).zip(&kept.junctions) {
            let spread = wing.shared.forward(&wing.vertices, &product.own, change, stopping)?;
            convergence = convergence.and(spread);
            let slides = wing.slides(set_up, &product.loft, before)?;
            let Some(strip) = &mut wing.strip else { continue };
            let mut slide = vec![DVec3::ZERO; change.len()];
            for ((&place, (by_place, by_direction)), &turned) in
                wing.junction.iter().zip(slides).zip(&product.direction)
            {
                let vertex = wing.vertices[place] as usize;
                slide[vertex] = by_place * change[vertex] + by_direction * turned - change[vertex];
            }
            set_up.families.partners.even_slide(&wing.vertices, change, &mut slide);
            convergence = convergence.and(strip.forward(&mut slide, stopping)?);
            for &vertex in &wing.vertices {
                change[vertex as usize] += slide[vertex as usize];
            }
        }
        Ok(convergence)
    }

    /// [`Wings::interpolate_reverse`] must run after. The derivative by the displacement before the
    /// stage stays at the wings' vertices until then.
    fn reverse(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let mut convergence = Convergence::nothing_to_do();
        self.products.clear();
        for (wing, before) in self.wings.iter_mut().zip(&kept.junctions).rev() {
            let loft = wing.loft(kept)?;
            let mut own = vec![DVec3::ZERO; wing.vertices.len()];
            let mut direction = vec![DVec3::ZERO; wing.junction.len()];
            let slides = wing.slides(set_up, &loft, before)?;
            if let Some(strip) = &mut wing.strip {
                let mut by_slide = vec![DVec3::ZERO; gradient.len()];
                for &vertex in &wing.vertices {
                    by_slide[vertex as usize] = gradient[vertex as usize];
                }
                convergence = convergence.and(strip.reverse(&mut by_slide, stopping)?);
                set_up.families.partners.even_slide_reverse(&wing.vertices, gradient, &mut by_slide);
                let junction = wing.junction.iter().zip(slides).zip(&mut direction);
                for ((&place, (by_place, by_direction)), turned) in junction {
                    let vertex = wing.vertices[place] as usize;
                    *turned = by_direction.transpose() * by_slide[vertex];
                    gradient[vertex] += by_place.transpose() * by_slide[vertex] - by_slide[vertex];
                }
            }
            let spread = wing.shared.reverse(&wing.vertices, &mut own, gradient, stopping)?;
            convergence = convergence.and(spread);
            self.products.push(WingProduct { loft, own, direction });
        }
        self.products.reverse();
        Ok(convergence)
    }
}
