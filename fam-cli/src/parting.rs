//! What of a document belongs together.

use fam::Parting;
use fam_io::Labels;

/// Objects are apart; materials too, each with a square of its own, if `per_material`.
pub fn parting(labels: &Labels, per_material: bool) -> Parting {
    if per_material && !labels.materials.is_empty() {
        Parting::by_material(&labels.objects, &labels.materials)
    } else {
        Parting::by_object(&labels.objects)
    }
}
