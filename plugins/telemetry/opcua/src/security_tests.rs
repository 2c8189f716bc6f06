use super::*;

#[test]
fn the_first_of_a_chain_is_found() {
    assert_eq!(der_length(&[0x30, 0x03, 1, 2, 3, 0x30]), Some(5));
    assert_eq!(der_length(&[0x30, 0x82, 0x01, 0x00]), Some(260));
    for none in [&[][..], &[0x30], &[0x31, 1], &[0x30, 0x80], &[0x30, 0x84, 1, 1, 1, 1]] {
        assert_eq!(der_length(none), None, "{none:?}");
    }
    // It says that it is longer than what there is.
    assert!(leaf(&ByteString::from(&[0x30, 0x82, 0x01, 0x00])).is_err());
}
