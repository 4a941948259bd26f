"""The page on which a visitor is the pedestrian.

    settings.py   what a visitor may change        visitor.py    the person they steer
    stage.py      scenario + settings → one trip    navigators.py the planners to choose from
    world.py      one robot among the people        frames.py     what the browser is told of it
    tally.py      what its trips came to
    evidence.py   chances taken and ignored         words.py      one line of plain words
    session.py    one visitor's worlds and clock    replay.py     a finished record, same interface
    chronicle.py  what a record as a whole tells
    album.py      predictions kept for the record
    heat.py       predictions as images             wire.py       messages to the browser
    messages.py   messages from the browser         stream.py     the websocket between them
    visits.py     who is visiting                   server.py     serves the page
    page.py, controls.py   NiceGUI elements         assets/       scene, charts and keys in the browser

Everything above `stream.py` knows no browser and is tested without one.
"""
