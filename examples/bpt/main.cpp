// The reference renderer's command line: renders scenes and writes their images.
#include "command_line.hpp"

namespace {

using real = float;

void render(const std::string& name, const bpt::options& o) {
    const bpt::scene<real> scene = bpt::make_scene<real>(name);
    bpt::renderer renderer(scene, bpt::settings_of(o, scene), mis::power_heuristic{o.beta});
    bpt::film film(o.size);
    while (film.passes < o.samples && !tools::interrupted) {
        bpt::add_pass(renderer, film);
        bpt::show_progress(name, film.passes, o.samples);
    }
    bpt::write_image(o.output + "/" + name, film, static_cast<double>(scene.exposure));
    if (tools::interrupted)
        tools::report_interruption(name, film.passes, o.samples);
}

} // namespace

int main(int count, char** arguments) {
    CLI::App app{"Reference bidirectional path tracer: renders small scenes as NAME.png and NAME.exr.\n"
                 "Exit status: 0, 2 bad input or output, 130 interrupted: the image is of the passes done."};
    bpt::options o;
    bpt::add_options(app, o);
    return bpt::run_program(app, o, count, arguments, [&] {
        for (const auto& name : bpt::scenes_of(o))
            if (!tools::interrupted)
                render(name, o);
        return 0;
    });
}
