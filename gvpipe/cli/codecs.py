"""`codecs`, which lists those that are installed, and `new-codec`, which begins another one."""

from __future__ import annotations

import click

from gvpipe.cli.console import Output, output_options


@click.command()
@output_options
def codecs(out: Output) -> None:
    """List the codecs and their settings, and the settings that --codec auto tries beside the defaults."""
    import dataclasses

    from gvpipe.coding.registry import codec_class, codec_ids
    from gvpipe.rate_control.purposes import VARIANTS

    with out.progress():
        found = {name: codec_class(name) for name in codec_ids()}
    settings = {name: {field.name: field.default for field in dataclasses.fields(codec)} for name, codec in found.items()}
    variants = {name: [own for own in VARIANTS.get(name, ()) if own] for name in found}
    values = [
        {"id": name, "version": codec.version, "summary": codec.summary, "settings": settings[name], "variants": variants[name]}
        for name, codec in found.items()
    ]
    out.json({"codecs": values})
    for name, codec in found.items():
        defaults = " ".join(f"{key}={value}" for key, value in settings[name].items())
        out.text(f"{name}: {codec.summary}; {defaults}")
        for own in variants[name]:
            out.text(f"  --codec auto tries too: {' '.join(f'{key}={value}' for key, value in own.items())}")


@click.command("new-codec")
@click.argument("name")
@click.argument("folder", required=False)
@output_options
def new_codec(name: str, folder: str | None, out: Output) -> None:
    """Write a package with a codec that works, and the tests that every codec must pass, to change into your own.

    \b
    gvpipe new-codec mycodec
    pip install -e mycodec && gvpipe codecs
    """
    from gvpipe.testing.new_codec import new_codec as write

    files = [str(path) for path in write(name, folder)]
    out.json({"name": name, "output": folder or name, "files": files})
    out.text(f"{folder or name}: {len(files)} files; next, in that folder: pip install -e '.[test]' && pytest")
