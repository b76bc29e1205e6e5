// Python bindings of the restorer.
#include "arrays.h"
#include "kernels/types.h"
#include "parts.h"

namespace {

using Places = nb::ndarray<const int32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

constexpr int64_t kRows = 8;  // of a part; which they are does not depend on the threads

// The places are tried before anything is read: a wrong one would be outside of the pictures.
void expect_inside(const int32_t* away, int reach) {
  for (int k = 0; k < 2; k++)
    if (away[k] < -reach || away[k] > reach)
      throw nb::value_error("taps, details: expected places within the border of the pictures");
}

void mix(In answer, In pictures, Places taps, Places details, float own, float most_detail, float gentle, Out mixed) {
  if (answer.ndim() != 3 || pictures.ndim() != 4 || pictures.shape(1) != 4 || taps.shape(1) != 3 || details.shape(1) != 2)
    throw nb::value_error("expected answer (k, h, w), pictures (n, 4, h2, w2), taps (t, 3) and details (d, 2)");
  dd::MixTask whole = {};
  whole.height = int(answer.shape(1));
  whole.width = int(answer.shape(2));
  whole.taps = int(taps.shape(0));
  whole.details = int(details.shape(0));
  whole.reach = (int(pictures.shape(2)) - whole.height) / 2;
  if (whole.reach < 0 || int(pictures.shape(2)) != whole.height + 2 * whole.reach ||
      int(pictures.shape(3)) != whole.width + 2 * whole.reach || whole.taps < 1 ||
      int(answer.shape(0)) != whole.taps + whole.details)
    throw nb::value_error("answer, pictures, taps, details: their shapes do not fit each other");
  expect_size("mixed", mixed.size(), 3 * answer.shape(1) * answer.shape(2));
  for (int k = 0; k < whole.taps; k++) {
    const int32_t* tap = taps.data() + 3 * k;
    if (tap[0] < 0 || tap[0] >= int(pictures.shape(0))) throw nb::value_error("taps: there is no such picture");
    expect_inside(tap + 1, whole.reach);
  }
  for (int k = 0; k < whole.details; k++) expect_inside(details.data() + 2 * k, whole.reach);
  whole.answer = answer.data();
  whole.pictures = pictures.data();
  whole.tap = taps.data();
  whole.detail = details.data();
  whole.mixed = mixed.data();
  whole.own = own;
  whole.most_detail = most_detail;
  whole.gentle = gentle;
  nb::gil_scoped_release release;
  in_parts(whole.height, kRows, [&](int64_t first, int64_t last, int64_t) {
    dd::MixTask task = whole;
    task.first = int(first);
    task.last = int(last);
    dd::kernels().mix(task);
  });
}

}  // namespace

void bind_restore(nb::module_& m) {
  m.def("mix", &mix, array("answer"), array("pictures"), array("taps"), array("details"), "own"_a, "most_detail"_a,
        "gentle"_a, array("mixed"));
}
