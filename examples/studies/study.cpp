#include "study.hpp"
#include <tools/command_line.hpp>

namespace studies {

struct command_line::parser : CLI::App {
    using CLI::App::App;

    template <class T>
    void add_checked(const std::string& name, T& value, const std::string& what,
                     const CLI::Validator& check) {
        add_option(name, value, what)->check(check)->capture_default_str();
    }
    template <class T>
    void add_words(const std::string& name, T& words, const std::string& what,
                   const std::vector<std::string>& known) {
        add_checked(name, words, what, known.empty() ? CLI::Validator() : CLI::IsMember(known));
    }
};

command_line::command_line(const std::string& what, common_options& o)
    : all(std::make_unique<parser>(
          what + "\nExit status: 0 all checks pass, 1 some do not, 2 bad input or output.")),
      report_only(o.report_only) {
    add("--output", o.output, "folder to write to", {});
    all->add_option("--seed", o.seed, "of all random numbers")->capture_default_str();
    add("--report-only", o.report_only, "a missed bar is no failure: for runs too short to meet it");
}
command_line::command_line(const std::string& what, image_options& o)
    : command_line(what, static_cast<common_options&>(o)) {
    add("--size", o.size, "width and height in pixels", 4, 1024);
    add("--threads", o.threads, "that render", 1, 1024);
}
command_line::~command_line() = default;

void command_line::add(const std::string& name, int& value, const std::string& what, int least,
                       int greatest) {
    all->add_checked(name, value, what, CLI::Range(least, greatest));
}
void command_line::add(const std::string& name, double& value, const std::string& what, double least,
                       double greatest) {
    all->add_checked(name, value, what, CLI::Range(least, greatest) & tools::is_number());
}
void command_line::add(const std::string& name, std::vector<int>& values, const std::string& what, int least,
                       int greatest) {
    all->add_checked(name, values, what, CLI::Range(least, greatest));
}
void command_line::add(const std::string& name, std::vector<double>& values, const std::string& what,
                       double least, double greatest) {
    all->add_checked(name, values, what, CLI::Range(least, greatest) & tools::is_number());
}
void command_line::add_multiple(const std::string& name, int& value, const std::string& what, int of) {
    const std::string unit = "multiple of " + std::to_string(of);
    const auto complaint = [of, unit](const std::string& text) {
        int n = 0;
        const bool good = CLI::detail::lexical_cast(text, n) && n > 0 && n % of == 0;
        return good ? std::string() : "not a positive " + unit + ": " + text;
    };
    all->add_checked(name, value, what, CLI::Validator(complaint, "a " + unit));
}
void command_line::add(const std::string& name, std::string& word, const std::string& what,
                       const std::vector<std::string>& known) {
    all->add_words(name, word, what, known);
}
void command_line::add(const std::string& name, std::vector<std::string>& words, const std::string& what,
                       const std::vector<std::string>& known) {
    all->add_words(name, words, what, known);
}
void command_line::add(const std::string& name, bool& flag, const std::string& what) {
    all->add_flag(name, flag, what);
}

int command_line::run(int count, char** arguments, const std::function<bool()>& work) {
    return tools::run_program(*all, count, arguments, [&] { return work() || report_only ? 0 : 1; });
}

} // namespace studies
