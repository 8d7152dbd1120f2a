#include "report.hpp"

#include <algorithm>
#include <cmath>

namespace check_paths {

using mis::name_of;

namespace {

constexpr std::size_t most_remarks = 5; // of each kind

// As mis::agree compares weights.
double relative_error(double claimed, double right) {
    if (!mis::is_number(claimed))
        return std::numeric_limits<double>::infinity();
    const double larger = std::max(std::abs(claimed), std::abs(right));
    return larger > 1e-30 ? std::abs(claimed - right) / larger : 0;
}

bool is_usable(const mis::judgement& j) {
    return j.verdict != mis::verdict::incomplete && j.verdict != mis::verdict::bad_numbers;
}

void add_judgement(tally& t, const mis::judgement& j, double error) {
    const bool is_weighed = j.verdict == mis::verdict::agrees || j.verdict == mis::verdict::disagrees;
    ++t.records;
    t.agreeing += j.verdict == mis::verdict::agrees;
    t.disagreeing += j.verdict == mis::verdict::disagrees;
    t.undecided += j.verdict == mis::verdict::undecided;
    t.unusable += !is_usable(j);
    if (is_weighed)
        t.largest_error = std::max(t.largest_error, error);
}

std::string format_number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", x);
    return text;
}

std::string describe_disagreement(const mis::path_record& record, const mis::judgement& j) {
    return std::string(name_of(record.technique.kind)) + " of " + std::to_string(record.vertices.size()) +
           " vertices, weight " + format_number(record.weight) + ", should be " + format_number(j.right);
}
std::string describe_unusable(const mis::judgement& j) {
    const std::string vertex = j.place.vertex < 0 ? "" : "vertex " + std::to_string(j.place.vertex) + ": ";
    const char* fault = j.verdict == mis::verdict::incomplete   ? " is missing, or what it follows from"
                        : std::string(j.place.field) == "alpha" ? " is not between 0 and 1"
                                                                : " is negative or not finite";
    return vertex + "\"" + j.place.field + "\"" + fault;
}

// A weight that is no number, and where the first such number arises.
std::string describe_no_number(const mis::path_record& record, const mis::judgement& j,
                               const mis::weight_terms& terms) {
    const std::string weight = "weight " + format_number(record.weight);
    if (!is_usable(j))
        return weight + ", " + describe_unusable(j);
    const int vertex = mis::first_float_overflow(terms);
    if (vertex >= 0)
        return weight + ", should be " + format_number(j.right) + ": from vertex " + std::to_string(vertex) +
               " on, the product of densities is 0 or leaves the range of float";
    return weight + ", should be " + format_number(j.right) + ": all densities are ordinary numbers";
}

void keep(std::vector<remark>& remarks, std::size_t most, std::int64_t line, const std::string& what) {
    if (remarks.size() < most)
        remarks.push_back({line, what});
}

void print_row(std::FILE* out, const char* technique, const std::string& vertices, const tally& t) {
    std::fprintf(out, "%-18s %8s %10lld %10lld %10lld %10lld %10lld   %.1e\n", technique, vertices.c_str(),
                 static_cast<long long>(t.records), static_cast<long long>(t.agreeing),
                 static_cast<long long>(t.disagreeing), static_cast<long long>(t.undecided),
                 static_cast<long long>(t.unusable), t.largest_error);
}

void print_remarks(std::FILE* out, const char* heading, std::int64_t count,
                   const std::vector<remark>& remarks) {
    if (count == 0)
        return;
    std::fprintf(out, "\n%s: %lld\n", heading, static_cast<long long>(count));
    for (const remark& one : remarks)
        std::fprintf(out, "  line %lld: %s\n", static_cast<long long>(one.line), one.what.c_str());
    if (!remarks.empty() && count > static_cast<std::int64_t>(remarks.size()))
        std::fprintf(out, "  ...\n");
}

nlohmann::ordered_json to_json(const tally& t) {
    nlohmann::ordered_json j{{"records", t.records},
                             {"agreeing", t.agreeing},
                             {"disagreeing", t.disagreeing},
                             {"undecided", t.undecided},
                             {"unusable", t.unusable}};
    if (mis::is_number(t.largest_error)) // JSON has no infinity
        j["largest_error"] = t.largest_error;
    else
        j["largest_error"] = nullptr;
    return j;
}

// Mistakes that could explain what is left, without repetition, by the fields that would tell them. None
// where nothing is left.
std::map<std::string, std::vector<std::string>> missing_fields(const mis::finding& found) {
    std::map<std::string, std::vector<std::string>> identifiers;
    if (found.explained == found.disagreeing)
        return identifiers;
    for (const mis::mistake* m : found.unknown) {
        auto& list = identifiers[m->needs];
        if (std::find(list.begin(), list.end(), m->identifier) == list.end())
            list.push_back(m->identifier);
    }
    return identifiers;
}

std::string joined(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words)
        text += (text.empty() ? "" : ", ") + word;
    return text;
}

bool is_unexplained(const report& r, const mis::finding& found) {
    return found.suspects.empty() && r.all.disagreeing > 0;
}

void print_explained(std::FILE* out, const char* who, const mis::finding& found) {
    std::fprintf(out, "%s %lld of %lld wrong weights, would change %lld of %lld right ones.\n", who,
                 static_cast<long long>(found.explained), static_cast<long long>(found.disagreeing),
                 static_cast<long long>(found.spoiled), static_cast<long long>(found.agreeing));
}

void print_suspect(std::FILE* out, const mis::suspect& s, const mis::finding& found) {
    const std::string where = mis::describe(s.where);
    std::fprintf(out, "\nsuspect: %s%s\n  %s\n", s.mistake->identifier,
                 where.empty() ? "" : (", " + where).c_str(), mis::describe(s).c_str());
    if (found.suspects.size() == 1)
        print_explained(out, "  Explains", found);
    else
        std::fprintf(out, "  Needed for %lld of %lld wrong weights.\n", static_cast<long long>(s.affected),
                     static_cast<long long>(found.disagreeing));
    if (s.prevalence < 0.95)
        std::fprintf(
            out,
            "  It shows in %.2g %% of the weights that it would change; neither technique nor length nor "
            "kind of vertex tells in which.\n",
            100 * s.prevalence);
    for (const auto& e : s.examples)
        std::fprintf(out, "  line %lld: weight %.9g, should be %.9g, with the mistake %.9g\n",
                     static_cast<long long>(e.line), e.claimed, e.right, e.predicted);
    std::fprintf(out, "  %s\n", s.mistake->advice);
}

void print_suspects(std::FILE* out, const report& r, const mis::finding& found) {
    for (const mis::suspect& s : found.suspects)
        print_suspect(out, s, found);
    if (found.suspects.size() > 1)
        print_explained(out, "\nTogether: explain", found);
    if (!found.suspects.empty() && found.disagreeing < r.all.disagreeing)
        std::fprintf(out, "%sThese numbers are those of a random sample.\n",
                     found.suspects.size() > 1 ? "" : "\n");
    for (const mis::mistake* m : found.equivalent)
        std::fprintf(out, "\nThe same weights would follow from %s: %s\n", m->identifier, m->what);
    if (is_unexplained(r, found))
        std::fprintf(out, "\nsuspect: unexplained\n  No mistake known here explains these weights.\n");
    for (const mis::suspect& s : found.closest)
        std::fprintf(out, "  Closest: %s. %s\n", s.mistake->identifier, mis::describe(s).c_str());
    if (!found.closest.empty())
        print_explained(out, "  That explains", found);
    for (const auto& [field, identifiers] : missing_fields(found))
        std::fprintf(out, "\nSome records lack %s. Without it these cannot be told: %s\n", field.c_str(),
                     joined(identifiers).c_str());
}

nlohmann::ordered_json to_json(const mis::finding& found) {
    auto list = nlohmann::ordered_json::array();
    for (const mis::suspect& s : found.suspects) {
        auto examples = nlohmann::ordered_json::array();
        for (const auto& e : s.examples)
            examples.push_back(
                {{"line", e.line}, {"weight", e.claimed}, {"right", e.right}, {"predicted", e.predicted}});
        list.push_back({{"identifier", s.mistake->identifier},
                        {"what", mis::describe(s)},
                        {"where", mis::describe(s.where)},
                        {"prevalence", s.prevalence},
                        {"advice", s.mistake->advice},
                        {"changes", s.affected},
                        {"examples", examples}});
        if (s.mistake == &mis::wrong_constant) {
            list.back()["given"] = s.constant.given;
            list.back()["fitted"] = s.constant.fitted;
        }
    }
    return list;
}

nlohmann::ordered_json identifiers_of(const std::vector<mis::suspect>& suspects) {
    auto list = nlohmann::ordered_json::array();
    for (const mis::suspect& s : suspects)
        list.push_back(s.mistake->identifier);
    return list;
}
nlohmann::ordered_json identifiers_of(const std::vector<const mis::mistake*>& mistakes) {
    auto list = nlohmann::ordered_json::array();
    for (const mis::mistake* m : mistakes)
        list.push_back(m->identifier);
    return list;
}

nlohmann::ordered_json to_json(const std::vector<remark>& remarks) {
    auto list = nlohmann::ordered_json::array();
    for (const remark& one : remarks)
        list.push_back({{"line", one.line}, {"what", one.what}});
    return list;
}

void add_record(report& r, const mis::path_record& record) {
    const mis::judgement j = mis::judge(r.diagnosis, record);
    const double error = relative_error(record.weight, j.right);
    add_judgement(r.tallies[{record.technique.kind, static_cast<int>(record.vertices.size())}], j, error);
    add_judgement(r.all, j, error);
    if (!mis::is_number(record.weight) || record.weight < 0) {
        ++r.weights_no_numbers;
        keep(r.no_numbers, most_remarks, record.line, describe_no_number(record, j, r.diagnosis.right_terms));
    } else if (j.verdict == mis::verdict::disagrees) {
        keep(r.disagreeing, most_remarks, record.line, describe_disagreement(record, j));
    }
    if (!is_usable(j))
        keep(r.unusable, most_remarks, record.line, describe_unusable(j));
    r.incomplete += j.verdict == mis::verdict::incomplete;
}

} // namespace

bool add_next(report& r, path_reader& reader) {
    std::string error;
    switch (next_record(reader, r.record, error)) {
    case read_status::record:
        add_record(r, r.record);
        return true;
    case read_status::malformed:
        ++r.malformed_lines;
        keep(r.malformed, most_remarks, reader.lines.line, error);
        return true;
    case read_status::failed:
        r.failure = error;
        break;
    case read_status::waiting:
    case read_status::end:
        break;
    }
    return false;
}

std::string complaint(const report& r, const std::string& file) {
    const bool is_empty = r.all.records == 0;
    if (!r.failure.empty())
        return "'" + file + "' cannot be read" + (is_empty ? "" : " to its end") + ": " + r.failure;
    return is_empty ? "'" + file + "' has no records" : "";
}

mis::finding suspects_in(const report& r, std::size_t examples) {
    return mis::suspects_of(r.diagnosis, examples);
}

int exit_status(const report& r, const mis::finding& found) {
    if (r.all.records == 0 || r.malformed_lines > 0 || r.incomplete > 0 || !r.failure.empty())
        return 2;
    const bool all_agree = r.all.agreeing + r.all.undecided == r.all.records;
    return all_agree && found.suspects.empty() ? 0 : 1;
}

void print(const report& r, const mis::finding& found, std::FILE* out) {
    std::fprintf(out, "%-18s %8s %10s %10s %10s %10s %10s   %s\n", "technique", "vertices", "records",
                 "agree", "disagree", "undecided", "unusable", "largest error");
    for (const auto& [key, t] : r.tallies)
        print_row(out, name_of(key.first), std::to_string(key.second), t);
    print_row(out, "all", "", r.all);
    print_remarks(out, "weights that disagree", r.all.disagreeing, r.disagreeing);
    print_remarks(out, "weights that are no numbers", r.weights_no_numbers, r.no_numbers);
    print_remarks(out, "records whose weight cannot be computed", r.all.unusable, r.unusable);
    print_remarks(out, "lines that are no records", r.malformed_lines, r.malformed);
    if (!r.failure.empty())
        std::fprintf(out, "\nthe input could not be read to its end: %s\n", r.failure.c_str());
    print_suspects(out, r, found);
}

nlohmann::ordered_json to_json(const report& r, const mis::finding& found) {
    auto tallies = nlohmann::ordered_json::array();
    for (const auto& [key, t] : r.tallies) {
        nlohmann::ordered_json row{{"technique", name_of(key.first)}, {"vertices", key.second}};
        row.update(to_json(t));
        tallies.push_back(row);
    }
    nlohmann::ordered_json j{{"tolerance", r.diagnosis.tolerance},
                             {"all", to_json(r.all)},
                             {"techniques", tallies},
                             {"suspects", to_json(found)},
                             {"unexplained", is_unexplained(r, found)},
                             {"closest", identifiers_of(found.closest)},
                             {"explained", found.explained},
                             {"looked_at", found.disagreeing},
                             {"spoiled", found.spoiled},
                             {"equivalent", identifiers_of(found.equivalent)},
                             {"missing_fields", missing_fields(found)},
                             {"weights_no_numbers", r.weights_no_numbers},
                             {"disagreeing", to_json(r.disagreeing)},
                             {"no_numbers", to_json(r.no_numbers)},
                             {"unusable", to_json(r.unusable)},
                             {"malformed_lines", r.malformed_lines},
                             {"malformed", to_json(r.malformed)}};
    if (!r.failure.empty())
        j["failure"] = r.failure;
    j["exit_status"] = exit_status(r, found);
    return j;
}

} // namespace check_paths
