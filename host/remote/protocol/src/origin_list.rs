//! Origins of a value as a list of their places in [`Origin::ALL`].

use busbar_types::Origin;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(crate) fn serialize<S: Serializer>(origin: &Origin, to: S) -> Result<S::Ok, S::Error> {
    let places = Origin::ALL.into_iter().zip(0_u8..);
    let set = places.filter(|(one, _)| origin.contains(*one)).map(|(_, place)| place);
    set.collect::<Vec<_>>().serialize(to)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Origin, D::Error> {
    let places = Vec::<u8>::deserialize(from)?;
    places.into_iter().try_fold(Origin::LIVE, |origin, place| {
        let one = Origin::ALL.get(usize::from(place));
        one.map(|one| origin | *one).ok_or_else(|| D::Error::custom("no such origin"))
    })
}
