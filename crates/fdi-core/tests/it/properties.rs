//! Properties of the container of artefacts.

use fdi_core::store::{ArtefactKind, open, seal};
use proptest::prelude::*;

proptest! {
    #[test]
    fn property_containers_give_back_what_was_sealed(
        payload in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let bytes = seal(ArtefactKind::Bundle, &payload);
        prop_assert_eq!(open(&bytes, ArtefactKind::Bundle), Ok(&payload[..]));
        prop_assert!(open(&bytes[..bytes.len() - 1], ArtefactKind::Bundle).is_err());
    }

    #[test]
    fn property_any_bytes_are_opened_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let sealed = [&seal(ArtefactKind::Bundle, &[])[..16], &bytes].concat();
        prop_assert!(open(&bytes, ArtefactKind::Bundle).is_err());
        prop_assert!(open(&sealed, ArtefactKind::Bundle).is_err());
    }
}
