/* Tests: `make test`. */

#include "plugin.c"

#undef NDEBUG
#include <assert.h>

static void check(double number, const char *text, BusbarSeverity severity) {
    Binding binding = {.limit_low = NAN, .limit_high = 95, .unit_len = 1, .unit = "A"};
    BusbarTagValue value = {.kind = BUSBAR_VALUE_KIND_F64, .number = number};
    char into[MAX_PART];
    size_t len = format(&value, &binding, into);
    assert(len == strlen(text) && memcmp(into, text, len) == 0);
    assert(judge(&value, &binding) == severity);
}

/* The verdict on a piece of equipment with one value, by its reason. */
static void check_verdict(double number, BusbarQuality quality, double high, BusbarVerdict expected,
                          const char *reason) {
    Binding binding = {.limit_low = NAN, .limit_high = high, .next = 1, .name_len = 3, .name = "Oil"};
    Piece piece = {.id = "T1"};
    Instance self = {.bindings = &binding, .count = 1, .pieces = &piece, .piece_count = 1};
    BusbarTagValue value = {.kind = BUSBAR_VALUE_KIND_F64, .quality = quality, .number = number};
    uint8_t text[MAX_PART];
    uint32_t basis[1];
    BusbarOverlayVerdict verdict;
    BusbarOverlayOutput output = {.text_capacity = MAX_PART,
                                  .text = text,
                                  .verdict_capacity = 1,
                                  .verdicts = &verdict,
                                  .basis_capacity = 1,
                                  .basis = basis};
    assert(judge_piece(&self, 0, &value, &output) && output.verdict_count == 1);
    assert(verdict.verdict == expected && verdict.reason_len == strlen(reason));
    assert(memcmp(text, reason, verdict.reason_len) == 0);
}

int main(void) {
    check(61.52, "61.52 A", BUSBAR_SEVERITY_NORMAL);
    check(95.1, "95.1 A", BUSBAR_SEVERITY_WARNING);
    check(-1e300, "-1e+300 A", BUSBAR_SEVERITY_NORMAL);
    check(-0.0, "0 A", BUSBAR_SEVERITY_NORMAL);
    check_verdict(61, BUSBAR_QUALITY_GOOD, 95, BUSBAR_VERDICT_NORMAL, "");
    check_verdict(96, BUSBAR_QUALITY_GOOD, 95, BUSBAR_VERDICT_ABNORMAL, "Oil is outside its limits");
    check_verdict(61, BUSBAR_QUALITY_BAD, 95, BUSBAR_VERDICT_UNKNOWN, "Oil is not good");
    check_verdict(NAN, BUSBAR_QUALITY_GOOD, 95, BUSBAR_VERDICT_UNKNOWN, "Oil is not good");
    check_verdict(61, BUSBAR_QUALITY_GOOD, NAN, BUSBAR_VERDICT_NORMAL,
                  "assumed: no limits are configured");
    assert(cut((const uint8_t *)"a\xc3\xb6", 3, 2) == 1);
    puts("10 tests passed");
    return 0;
}
