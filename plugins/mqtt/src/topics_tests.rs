use super::*;

#[test]
fn filters_cover_what_the_standard_says() {
    let cases = [
        ("a/b", "a/b", true),
        ("a/b", "a/b/c", false),
        ("a/#", "a", true),
        ("a/#", "a/b/c", true),
        ("a/#", "ab", false),
        ("+/b", "a/b", true),
        ("+/b", "a/c", false),
        ("a/+/c", "a/b/c", true),
        ("a/+", "a", false),
        ("#", "a/b", true),
        ("#", "$SYS/a", false),
    ];
    for (filter, topic, expected) in cases {
        assert_eq!(covers(filter, topic), expected, "{filter} {topic}");
    }
}
